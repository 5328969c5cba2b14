"""Environments that a scene asks for by name: ``preset = "studio"``, ``"sky"``, ``"sunset"``.

Each is a picture made when it is first asked for, and the lights that belong to it (``base.py``). ``sky.py`` has sun
and sky, by the model of ``preetham.py`` and ``sunlight.py``; ``soft_boxes.py`` a photographer's studio. Imports
``files/``.
"""
