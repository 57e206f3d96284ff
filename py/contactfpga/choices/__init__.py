"""Choices of a Skin: labellers, scans, debounces, converters and reports, each registered in one place.

A choice has a name, a title, bounds and requirements, and the places of gateware and golden rule, which are loaded on
demand.
"""
