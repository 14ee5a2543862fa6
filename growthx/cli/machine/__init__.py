"""Commands about the machine and the installation rather than about bone: versions, what is missing, completion."""
