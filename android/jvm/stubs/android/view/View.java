package android.view;

import android.content.Context;
import android.graphics.Canvas;

/** As much of Android's class as the demo uses: it compiles against it, nothing runs. */
public class View {
    public View(Context context) {}

    public int getWidth() {
        return 0;
    }

    public int getHeight() {
        return 0;
    }

    public void invalidate() {}

    protected void onDraw(Canvas canvas) {}

    public void setOnClickListener(OnClickListener listener) {}

    /** What a click calls. */
    public interface OnClickListener {
        void onClick(View view);
    }
}
