"""Fields that follow from a state: what each is, a table of them, and which of them are asked for where."""
