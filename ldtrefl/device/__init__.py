"""Kernels: defined, compiled and launched, on CPU threads or CUDA; and C++ for the bodies of native functions.

Imports ``base``. Start with ``launch.py``. The threads are in ``cpu_threads.py``, and all that is private to Warp is in
``warp_abi.py``.
"""
