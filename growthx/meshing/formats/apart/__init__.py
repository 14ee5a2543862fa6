"""Reading in a process of its own: what runs there, one module for each library, and what starts it (`process`).

Those modules know nothing of growthx, and of libraries what they read with.
"""
