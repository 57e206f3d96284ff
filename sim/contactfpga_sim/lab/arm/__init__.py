"""The experiment of the paper's Section IV: an arm under the sheet runs into a human arm, and stops in time.

The physics is simulated; the detection is the compiled gateware, and the host reads it with the real driver.
"""
