"""Output of results: tables, files, pictures, movies and pages."""
