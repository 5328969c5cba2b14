"""Where the habits of ``test_habits.py`` are not kept yet: habit -> file -> what it is. Entries are only taken out."""

STILL_TO_MEND: dict[str, dict[str, list[str]]] = {
    "every module has its test": {
        "ldtrefl/frame/bounces.py": ["no test of its name"],
        "ldtrefl/frame/camera_shading.py": ["no test of its name"],
        "ldtrefl/frame/first_hits.py": ["no test of its name"],
        "ldtrefl/frame/flat_regions.py": ["no test of its name"],
        "ldtrefl/frame/footprint.py": ["no test of its name"],
        "ldtrefl/frame/pixel_box.py": ["no test of its name"],
        "ldtrefl/frame/reflected_light.py": ["no test of its name"],
        "ldtrefl/frame/refollow.py": ["no test of its name"],
        "ldtrefl/frame/result.py": ["no test of its name"],
        "ldtrefl/frame/shadows.py": ["no test of its name"],
        "ldtrefl/frame/triangle_rows.py": ["no test of its name"],
        "ldtrefl/frame/visibility.py": ["no test of its name"],
        "ldtrefl/tracing/outlier_hits.py": ["no test of its name"],
    }
}
