"""The search of Zhang, Hsieh and Shen: equal steps, then bisection. Start with ``march.py``; its C++ is ``march.h``."""
