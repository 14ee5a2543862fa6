"""What a file or arrays hold made into a whole mesh on one rank: cells, names, islands; refused where it cannot be.

Knows `content`, not the formats that fill it in, and no ranks.
"""
