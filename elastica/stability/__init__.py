"""The second variation with moving contacts: index, eigenvalues, natural frequencies."""
