"""One module a node: parameters, messages and one object of `tld` or `following` behind them."""
