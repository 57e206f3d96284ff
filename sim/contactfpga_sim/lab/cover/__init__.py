"""Formulas for foam covers against integrals and the paper."""
