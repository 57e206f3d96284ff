"""The paper's Section IV: an arm under the sheet runs into a human arm, and stops in time.

Physics is simulated; detection is the compiled gateware and the real driver.
"""
