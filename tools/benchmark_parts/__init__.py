"""What ``tools/benchmark.py`` measures, a file a question."""
