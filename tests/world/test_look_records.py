"""The records of looks: constants that C++ and Python share."""

from ldtrefl.shading import finish
from ldtrefl.world import look_records


def test_slots_are_numbered_without_a_gap() -> None:
    names = ("BASE", "METALLIC_ROUGHNESS", "NORMAL", "OCCLUSION", "EMISSION", "SPECULAR", "SPECULAR_COLOR")
    names += ("CLEARCOAT", "CLEARCOAT_ROUGHNESS")
    assert [getattr(look_records, name) for name in names] == list(range(look_records.SLOTS))
    assert len(look_records.SlotNumbers()) == look_records.SLOTS == finish.CONSTANTS["SLOTS"]
