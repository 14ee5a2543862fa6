"""Parts of a body that move with fewer degrees of freedom than their nodes have, and what that does to the balances."""
