"""The version of the client, that of base/version.h."""
__version__ = "0.1.0"
