"""What the commands in scripts/ share, for your own scripts too.

result      read a result file into numpy arrays
program     run the program on a deck
report      tables, the machine's name, a progress bar
figures     the look of figures
tradeoff    scripts/tradeoff: what accuracy costs
peers       scripts/compare: the same deck in CalculiX and GetFEM
"""
