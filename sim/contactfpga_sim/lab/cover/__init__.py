"""Formulas for covers of foam against integrals and the paper."""
