"""Run the matrix of extremes: small scenes, each at a limit, by AUTO and by the paper's solvers."""

import sys

from studies.extremes.matrix import main

if __name__ == "__main__":
    sys.exit(main())
