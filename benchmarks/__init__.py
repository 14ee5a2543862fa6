"""What growthx was measured by: programs to be run from the checkout, and in `results` what they left.

`python -m benchmarks` lists them.  A room for each question – accuracy, speed, robustness, stability – and `shared` for
what they have in common.
"""
