"""One log made of another: whole, or small."""
