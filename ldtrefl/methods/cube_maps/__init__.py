"""Parts of the method ``envmap``: cube maps about a reflector's centre, and how a reflected ray reads them.

Start with ``faces.py``, which says what lies where. ``drawing.py`` draws the maps; ``proxies.py``, ``impostor.py`` and
``layers.py`` read them. Everything is in device space, relative to the cube map's centre: a point is ``p - centre``.
"""
