"""What a run costs: Newton steps, growth with size, where the time goes, and other codes."""
