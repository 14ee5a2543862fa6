"""What is read off a state: fields, zones, indices, judgements, pictures.  Nothing here changes the state it reads."""
