"""FW16: attributes, graphical model, mass models and facades of residential buildings."""
