"""What ``mitsuba_comparison.py`` is made of."""
