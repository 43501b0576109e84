package dev.foresound;

/** The native library is not available on this device; the message has the reason and the remedy. */
public final class UnavailableException extends IllegalStateException {
    UnavailableException(String message, Throwable cause) {
        super(message, cause);
    }
}
