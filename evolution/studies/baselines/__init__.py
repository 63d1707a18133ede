"""What a search is compared with: a fitness that plans instead of driving."""
