"""Without MuJoCo one line says what to install."""

import importlib
import sys

import pytest

import contactfpga


def test_a_missing_mujoco_names_the_extra(monkeypatch):
    for name in [name for name in sys.modules if name.startswith("contactfpga") and "mujoco" in name]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(contactfpga.MissingExtra, match=r"install.*\[mujoco\]"):
        importlib.import_module("contactfpga.mujoco")
