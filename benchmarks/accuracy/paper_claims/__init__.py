"""The paper's statements one by one: each with a command that measures it, and what the numbers say of it."""
