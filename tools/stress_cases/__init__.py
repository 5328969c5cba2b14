"""The cases of the stress test, one per file: ``run(rays, pictures)`` gives a list of outcomes."""
