"""The same problems, solved by what a user can install besides Palanquin."""
