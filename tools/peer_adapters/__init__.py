"""The ray queries of other libraries, answered by ours, so that their own tests can be run on it."""
