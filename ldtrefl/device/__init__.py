"""Kernels: defined, compiled and launched, on CPU threads or CUDA; and C++ for the bodies of native functions.

Imports ``base``. Start with ``launch.py``; the threads stand in ``cpu_threads.py``, all that is private to Warp in
``warp_abi.py``.
"""
