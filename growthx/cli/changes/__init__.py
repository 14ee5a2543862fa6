"""Options of all scenes that change them: another growth law, exponents of a weight, point forces, histories."""
