"""What a Skin refuses, with the value and the limit."""

import pytest
from refused_skins import REFUSED

from contactfpga import ContactFPGAError, Skin, SkinError


@pytest.mark.parametrize(("changes", "message"), REFUSED, ids=[str(changes) for changes, _ in REFUSED])
def test_refused_with_value_and_limit(changes, message):
    with pytest.raises(SkinError) as caught:
        Skin(**changes)
    assert str(caught.value) == message
    assert isinstance(caught.value, ValueError)
    assert isinstance(caught.value, ContactFPGAError)


@pytest.mark.parametrize("field", ["rows", "connectivity", "pitch_x_mm", "clock_hz", "baud", "shift_hz"])
@pytest.mark.parametrize("digits", [400, 5000])
def test_numbers_that_no_float_holds_are_refused_in_a_short_sentence(field, digits):
    with pytest.raises(SkinError, match=f"^{field} is ") as caught:
        Skin(**{field: 10**digits})
    assert len(str(caught.value)) < 200
