"""Pictures of a result: figures of matplotlib. In a notebook the figures show themselves."""

import bipot

deck = bipot.Deck("A block under a ball", name="dent")
deck.block("BODY", cells=(6, 6, 3), size=(2.0, 2.0, 1.0), corner=(-1.0, -1.0, -1.0))
deck.material("STEEL", young=210000.0, poisson=0.3)
deck.section("STEEL", "BODY")
ball = deck.reference_node((0.0, 0.0, 3.0))
deck.sphere("BALL", centre=(0.0, 0.0, 3.0), radius=3.0, reference_node=ball)
deck.interaction("DRY", friction=0.2)
deck.pair("BODY-ZMAX", "BALL", "DRY")
with deck.step(increment=0.5):
    deck.boundary("BODY-ZMIN", "PINNED")
    deck.boundary(ball, 1, 6)
    deck.boundary(ball, 3, value=-0.02)
    deck.output(nodes=["U", "RF"], elements=["S"])

with bipot.run(deck) as result:
    for what in ("displacement", "stress", "pressure", "contact", "forces", "errors"):
        result.plot(what).savefig(f"{what}.png")
    result.to_html("dent.html")  # all of them, the plan and the certificate on one page
    # What the ball presses with is what its support and the foot of the block carry.
    pressed = result.pairs["BODY-ZMAX:BALL"].resultant[-1, 2]
    foot = result.points[:, 2] == -1.0
    carried = result.field("reaction_force")[foot, 2].sum()

print(f"the ball presses with {-pressed:.6g}, the foot carries {carried:.6g}")
assert pressed < -100.0
assert abs(carried / pressed + 1) < 1e-7
