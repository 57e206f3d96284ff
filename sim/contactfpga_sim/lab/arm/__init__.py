"""The experiment of the paper's Section IV: an arm under the sheet runs into a human arm, and stops in time.

The physics is simulated; detection is the compiled gateware, read with the real driver.
"""
