package android.view;

/** As much of Android's class as the demo uses: it compiles against it, nothing runs. */
public class Window {
    public void addFlags(int flags) {}
}
