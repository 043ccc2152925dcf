"""Ask what runs would cost before one is made, and what is wrong with a deck."""

import bipot

deck = bipot.Deck("A cube that is pulled", name="pulled")
deck.parameter(n=2)
deck.block("CUBE", cells=("<n>", "<n>", "<n>"), size=(1.0, 1.0, 1.0))
deck.material("STEEL", young=210000.0, poisson=0.3)
deck.section("STEEL", "CUBE")
with deck.step():
    deck.boundary("CUBE-ZMIN", "PINNED")
    deck.boundary("CUBE-ZMAX", 3, value=0.001)

for n in (2, 4, 8):
    plan = bipot.plan(deck, n=n)
    print(f"n = {n}: {plan.equations} equations, {plan.seconds:.2g} s,"
          f" {plan.memory_bytes / 1e6:.0f} MB, fits: {plan.fits}")
    # The lower face is held, the upper one along z.
    assert plan.equations == 3 * n * (n + 1) ** 2 - (n + 1) ** 2

deck.card("*ELASTICK")
messages = bipot.check(deck)
for message in messages:
    print(message)
assert len(messages) == 1 and "did you mean *ELASTIC" in messages[0].text, messages
