"""The version of the client, that of base/version.h."""
__version__ = "0.2.0"
