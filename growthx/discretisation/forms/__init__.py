"""The weak balances, term by term as the paper has them, and put together for the load cases of a scene."""
