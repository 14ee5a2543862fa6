"""What the benchmarks have in common: progress bars and tables, CSV files and pages, pictures, scenes."""
