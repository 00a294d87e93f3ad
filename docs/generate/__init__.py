"""What the documentation says of commands, rules and fields, made from the code that has them."""
