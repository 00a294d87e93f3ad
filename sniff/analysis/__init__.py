"""Statistics and judgements: mergeable values computed from rows and transactions. Pure."""
