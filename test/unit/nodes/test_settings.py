import pytest

from tld_follower.box import Box
from tld_follower.nodes.settings import checked
from tld_follower.nodes.tracker import parse_box


@pytest.mark.parametrize(
    ("value", "kind", "result"), [(1, float, 1.0), (2, int, 2), (True, bool, True), ("a", str, "a")]
)
def test_values_of_the_right_kind(value, kind, result):
    found = checked(value, "name", kind)
    assert found == result
    assert type(found) is kind


@pytest.mark.parametrize(
    ("value", "kind"), [("abc", int), (1.5, int), (True, int), ("maybe", bool), ([1], float), (-1, int)]
)
def test_other_values_are_refused_by_name(value, kind):
    with pytest.raises(ValueError, match="parameter seed"):
        checked(value, "seed", kind, lambda x: x >= 0)


@pytest.mark.parametrize("text", ["1,2,30,40", "[1, 2, 30, 40]", "(1.0,2.0,30,40)"])
def test_boxes_as_text(text):
    assert parse_box(text) == Box(1, 2, 30, 40)


def test_no_box():
    assert parse_box("") is None


@pytest.mark.parametrize("text", ["a,b", "1,2,3", "1,2,3,4,5", "1,2,3,x"])
def test_what_is_no_box(text):
    with pytest.raises(ValueError, match="init_box"):
        parse_box(text)
