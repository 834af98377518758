"""The engine on live data: sources of epochs, the session that navigates on them, sinks for what comes out."""
