"""A capture as one page for people who were not there: numbers, pictures, text. Nothing in it comes from a network."""
