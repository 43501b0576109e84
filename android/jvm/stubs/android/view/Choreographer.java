package android.view;

/** As much of Android's class as the demo uses: it compiles against it, nothing runs. */
public final class Choreographer {
    public static Choreographer getInstance() {
        throw new UnsupportedOperationException();
    }

    public void postFrameCallback(FrameCallback callback) {}

    public void removeFrameCallback(FrameCallback callback) {}

    /** What a frame calls. */
    public interface FrameCallback {
        void doFrame(long nanos);
    }
}
