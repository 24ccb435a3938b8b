"""States followed along load or shortening: what happens to them, and where a lost strip goes."""
