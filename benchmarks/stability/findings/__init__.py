"""What the rows of the parts say: sentences with their numbers, and tables, a module for each part."""
