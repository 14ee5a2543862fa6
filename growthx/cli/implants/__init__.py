"""The commands of bone around an implant: two runs each, the intact body and then that with the implant."""
