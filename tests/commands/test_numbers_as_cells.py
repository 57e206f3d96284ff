"""One rule for cells, wherever they come from: bools, or numbers with a threshold."""

import re
import struct
import warnings

import numpy as np
import pytest

from contactfpga.inputs.array_file import ArrayFileError, read
from contactfpga.skin import Skin
from contactfpga_sim.apps.fit.sources import source
from contactfpga_sim.model.scenes import scene
from contactfpga_sim.model.scenes.cells import pressed
from contactfpga_sim.model.scenes.recordings import Recording

VALUES = np.array([[[0, 30], [31, 255]]], np.uint8)
PRESSED = [[[False, False], [True, True]]]


@pytest.mark.parametrize("dtype", [np.uint8, np.int64, np.float16, np.float32, ">f8", ">u2"])
def test_numbers_above_the_threshold_are_pressed(dtype):
    found = pressed(VALUES.astype(dtype), "the array", 30.0)
    assert (found.dtype, found.tolist()) == (bool, PRESSED)


def test_a_threshold_that_the_type_of_the_numbers_cannot_hold_is_no_trouble():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert not pressed(VALUES.astype(np.float16), "the array", 1e9).any()
        assert pressed(VALUES, "the array", -1e300).all()


@pytest.mark.parametrize(
    ("values", "threshold", "message"),
    [
        (VALUES, None, "the array holds uint8; say above which value a cell is pressed"),
        (VALUES.astype(float), None, "the array holds float64; say above"),
        (VALUES, float("nan"), "the threshold of the array is nan"),
        (np.full((1, 2, 2), np.nan), 1.0, "the array holds 4 NaN"),
        (VALUES.astype(complex), 1.0, "the array holds complex128; cells are bools or numbers"),
        (VALUES.astype(str), 1.0, "cells are bools or numbers"),
    ],
)
def test_what_is_neither_is_refused(values, threshold, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        pressed(values, "the array", threshold)


@pytest.mark.parametrize("suffix", ["npy", "npz"])
def test_files_and_commands_share_the_rule(tmp_path, suffix):
    path = tmp_path / f"touch.{suffix}"
    frames = np.repeat(VALUES, 4, axis=0)
    np.save(path, frames) if suffix == "npy" else np.savez(path, pressed=frames)
    skin = Skin(rows=2, columns=2, settle_us=20.0)
    for numbers in (lambda: Recording.load(path), lambda: scene.scene(skin, str(path)), lambda: source(str(path))):
        with pytest.raises(ValueError, match="holds uint8; say above which value"):
            numbers()
    assert Recording.load(path, 30).pressed.tolist() == PRESSED * 4
    assert source(str(path), threshold=30).recording.pressed.tolist() == PRESSED * 4


def test_arrays_and_callbacks_follow_it_too():
    skin = Skin(rows=2, columns=2)
    with pytest.raises(ValueError, match="what the scene gave holds float64"):
        scene.scene(skin, lambda seconds: np.full((2, 2), np.nan))(0.0)
    with pytest.raises(ValueError, match="the array holds uint8"):
        scene.scene(skin, VALUES)


@pytest.mark.parametrize("rate", [np.nan, 0.0, -1.0, np.inf, 1e300, "fast", [1.0, 2.0], True, 1j])
@pytest.mark.parametrize("name", ["rate_hz", "pitch_mm"])
def test_odd_facts_of_a_recording_are_refused(tmp_path, name, rate):
    path = tmp_path / "touch.npz"
    np.savez(path, pressed=np.zeros((1, 2, 2), bool), **{name: rate})
    with pytest.raises(ValueError, match=f"`{name}` in "):
        Recording.load(path)


def header(text):
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text.encode()


@pytest.mark.parametrize(
    "start",
    [
        header("{'descr': '|O', 'fortran_order': False, 'shape': (1, 2, 2)}"),
        header("{'descr': '|V0', 'fortran_order': False, 'shape': (1000000000000000, 2, 2)}"),
        header("{'descr': '\x1b[31m', 'fortran_order': False, 'shape': (1, 2, 2)}"),
        header("(" * 9000),
        b"\x93NUMPY\x07\x00",
        b"",
    ],
)
def test_damaged_files_are_refused(tmp_path, start):
    path = tmp_path / "touch.npy"
    path.write_bytes(start + bytes(16))
    with pytest.raises(ArrayFileError, match=re.escape(str(path))) as caught:
        read(path, ("pressed",))
    assert str(caught.value).isprintable()


def test_bools_of_odd_bytes_are_true(tmp_path):
    path = tmp_path / "touch.npy"
    path.write_bytes(header("{'descr': '|b1', 'fortran_order': True, 'shape': (1, 2, 2)}") + bytes([0, 2, 255, 1]))
    (found,) = Recording.load(path).pressed
    assert found.tolist() == [[False, True], [True, True]]
    assert found.sum() == 3
