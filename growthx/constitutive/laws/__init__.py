"""Growth laws of the literature: a stimulus, a response with its lazy zone and rates, and what scales the rate."""
