"""The density that a run has ended with, as the start of another: by another variant, on another mesh or more ranks."""
