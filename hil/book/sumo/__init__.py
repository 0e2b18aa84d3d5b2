"""Chapter 10: Pal coaches Junior with Eq. 10.1 as the book prints it; what is measured of it, and its figures."""
