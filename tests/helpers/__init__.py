"""What several tests use: maps, slow twins, spoilt answers, random planning tasks."""
