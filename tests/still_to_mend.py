"""Where the habits of ``test_habits.py`` are not kept yet: habit -> file -> what it is. Entries are only taken out."""

STILL_TO_MEND: dict[str, dict[str, list[str]]] = {}
