"""What is looked at before a discretisation costs time, and before a march: arguments, fields, orders of magnitude."""
