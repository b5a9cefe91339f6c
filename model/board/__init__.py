"""What a board has around its axes."""
