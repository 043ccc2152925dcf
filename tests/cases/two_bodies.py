"""Run the decks that the cases of contact between bodies write."""

from program import Run


def solved(case, text, *options):
    """Run a deck that must be solved; return its open result."""
    run = Run(text, *options, name="deck")
    case.assertEqual(run.status, 0, run.errors)
    result = run.result()
    result.output = run.output
    case.addCleanup(result.close)
    case.assertTrue(result.history("certified").all())
    return result
