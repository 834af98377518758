import pytest

from polyins.checks.vouched import vouched
from polyins.errors import ImplausibleError, InputError


def test_a_kind_that_is_vouched_for_becomes_a_text() -> None:
    texts: list[str] = []
    with vouched(("units",), texts):
        raise ImplausibleError("units", "too fast")
    assert texts == ["too fast (accepted)"]


@pytest.mark.parametrize("error", [ImplausibleError("axes", "upside down"), InputError("no rows")])
def test_what_is_not_vouched_for_is_refused(error: InputError) -> None:
    with pytest.raises(InputError), vouched(("units",), []):
        raise error
