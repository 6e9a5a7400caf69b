"""The transfer methods that come with the package, with their authors' published settings."""
