"""What the page that compares all methods is made of."""
