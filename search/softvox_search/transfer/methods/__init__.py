"""The transfer methods that come with the package, each by its authors' published settings."""
