"""What every room may use: errors in one sentence, checks of arguments, names of arrays, what a run remembers, how a
program ends.  Knows no finite elements and no growth.
"""
