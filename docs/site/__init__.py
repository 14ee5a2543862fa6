"""The documentation as a site: `./run docs`. Its pages are the files of the repository, staged and built by Sphinx."""
